//! What is said of legs with U joints at both ends: they do not rotate about their own lines, and are often
//! written where legs that do are meant.

use crate::model::joint::JointKind;
use crate::model::mechanism::{Leg, Mechanism};

/// Which legs of a mechanism have U joints at both ends, and what follows; none without such legs.
#[must_use]
pub fn about(mech: &Mechanism) -> Option<String> {
    let held: Vec<&Leg> = mech.legs.iter().filter(|leg| is_held(leg)).collect();
    let names: Vec<&str> = held.iter().map(|leg| &leg.name[..]).collect();
    let instead = free(held.first()?);
    Some(format!(
        "Legs with U joints at both ends ({}) do not rotate about their own lines, which takes degrees of \
         freedom from the platform; {instead}",
        names.join(", ")
    ))
}

/// The joints of a leg that rotates freely, for one that has U joints at both ends; none for others.
#[must_use]
pub fn instead(leg: &Leg) -> Option<String> {
    is_held(leg).then(|| free(leg))
}

fn is_held(leg: &Leg) -> bool {
    [leg.base_kind(), leg.platform.kind] == [JointKind::Universal; 2]
}

fn free(leg: &Leg) -> String {
    let [u, s] = [JointKind::Universal, JointKind::Spherical].map(JointKind::letter);
    let letters = leg.letters();
    let base = letters.replacen(u, s, 1);
    let platform = letters.strip_suffix(u).map_or_else(String::new, |rest| format!("{rest}{s}"));
    format!("a leg that should rotate freely has a spherical joint at one end, {platform} or {base}")
}
