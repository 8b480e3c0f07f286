//! From the description of a leg to its drive.

use crate::model::drive::{Drive, Slider, Telescope};
use crate::model::joint::Normal;
use crate::model::mechanism::Body;
use crate::model::spec::{ANGLE_TOLERANCE, Fault, LegSpec, SliderSpec};
use crate::spatial::Vec3;

/// The drive that a leg's description asks for.
pub(super) fn make(leg: &LegSpec) -> Drive {
    match &leg.slider {
        None => Drive::Telescope(Telescope),
        Some(slider) => {
            Drive::Slider(Slider { rail: slider.axis.unit(), strut: slider.strut, branch: slider.branch })
        }
    }
}

/// The body of the first link where it has a description of its own: a carriage, which does not rotate, so
/// that its inertia is of no effect.
pub(super) fn own_body(leg: &LegSpec) -> Option<Body> {
    let carriage = leg.slider.as_ref()?.carriage.as_ref();
    Some(carriage.map_or(Body::NONE, |c| Body { mass: c.mass, center: c.center, ..Body::NONE }))
}

/// The strut at home, from its foot to b, where a drive's numbers allow one; `r` is from the base point.
pub(super) fn strut_at_home(leg: &LegSpec, r: Vec3<f64>) -> Result<Vec3<f64>, String> {
    leg.slider.as_ref().map_or(Ok(r), |slider| on_rail(slider, r))
}

fn on_rail(slider: &SliderSpec, r: Vec3<f64>) -> Result<Vec3<f64>, String> {
    let axis = slider.axis.unit();
    let across = r - axis * r.dot(axis);
    let (far, strut) = (across.norm(), slider.strut);
    let ahead = (strut * strut - far * far).sqrt();
    if !(ahead > ANGLE_TOLERANCE * strut) {
        return Err(format!(
            "is {strut} m; the platform point is {far:.6} m from the rail at the home pose, which the strut \
             must exceed: perpendicular to its rail it is singular"
        ));
    }
    Ok(across + axis * (slider.branch * ahead))
}

/// Adds what is wrong with a drive beside the leg's joints and the home pose, and tells the strut there, if
/// there is one.
pub(super) fn check(place: &str, leg: &LegSpec, r: Vec3<f64>, faults: &mut Vec<Fault>) -> Option<Vec3<f64>> {
    let Some(slider) = &leg.slider else { return Some(r) };
    if !(slider.axis.norm() > 0.0 && slider.strut > 0.0) {
        return None;
    }
    faults.extend(check_joints(place, leg, slider));
    on_rail(slider, r)
        .map_err(|message| faults.push(Fault::new(format!("{place}.slider.strut"), message)))
        .ok()
}

/// Joints that a slider can have: those whose constraints do not say where the carriage is.
fn check_joints(place: &str, leg: &LegSpec, slider: &SliderSpec) -> Vec<Fault> {
    let mut faults = Vec::new();
    let axis = slider.axis.unit();
    let square = leg.base.axis.is_none_or(|own| own.unit().dot(axis).abs() <= ANGLE_TOLERANCE);
    let along = leg.base.axis.is_none_or(|own| own.unit().cross(axis).norm() <= ANGLE_TOLERANCE);
    if leg.base.rod.is_some() {
        faults.push(Fault::new(format!("{place}.base.rod"), "a rod carries telescopic legs only"));
        return faults;
    }
    let (above, below) = (leg.platform.joint, leg.base.joint);
    match (below.normal(), above.normal()) {
        _ if below.is_fixed() => {
            let message = "is F; the strut must rotate on its carriage: give S, U or R";
            faults.push(Fault::new(format!("{place}.base.joint"), message));
        }
        (Some(Normal::Along(())), _) if !square => {
            faults.push(Fault::new(
                format!("{place}.base.axis"),
                "must be perpendicular to the rail: R on a carriage",
            ));
        }
        (Some(Normal::Across(())), Some(Normal::Across(()))) if !along => {
            let message = "must lie along the rail: U on a carriage, with U on the platform";
            faults.push(Fault::new(format!("{place}.base.axis"), message));
        }
        _ => {}
    }
    if let Some(Normal::Along(())) = above.normal() {
        let message = format!("is {}; a slider has S or U on the platform", above.letter());
        faults.push(Fault::new(format!("{place}.platform.joint"), message));
    }
    faults
}
