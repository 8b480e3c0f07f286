"""The way to viser, an optional package, and the one place that reaches behind its public names.

viser has no public way to choose which messages of pages it takes, nor to see where a page comes from. Of its
internals these are used, those of version 1.1: `inner_parts` finds them, or says which one has moved.
"""

from __future__ import annotations

import inspect
from collections.abc import MutableMapping
from dataclasses import dataclass, fields
from types import ModuleType
from typing import Any

from polypod.errors import PolypodError


class ViewerError(PolypodError):
    """A page that cannot be served, or a file of one that cannot be written."""


def require_viser() -> ModuleType:
    """The package viser; ViewerError with what to install where it lacks."""
    try:
        import viser
    except ImportError:
        raise ViewerError(
            "viser is not installed, which the viewer needs; install it with: pip install polypod[viewer]"
        ) from None
    return viser


@dataclass(frozen=True)
class InnerParts:
    """Of a `viser.ViserServer`."""

    sockets: Any
    """Its `viser.infra.WebsockServer`, whose `_handle_incoming_message` gets every message of a page."""
    controls: MutableMapping[str, Any]
    """The controls of the panel by their identifiers."""
    connections: MutableMapping[int, Any]
    """The connections, with the headers of their requests, by client."""
    update: type[Any]
    """The message that changes properties of a control: `uuid`, `updates`."""


def inner_parts(server: Any) -> InnerParts:
    """Those of a server.

    Raises:
        ViewerError: viser has moved one of them: without it nothing could keep pages from sending anything.
    """
    sockets = _found(server, "_websock_server", "ViserServer")
    if not inspect.iscoroutinefunction(_found(sockets, "_handle_incoming_message", "WebsockServer")):
        raise _moved("asynchronous WebsockServer._handle_incoming_message")
    update = _found(_found(require_viser(), "_messages", "viser"), "GuiUpdateMessage", "_messages")
    if not {"uuid", "updates"} <= {field.name for field in fields(update)}:
        raise _moved("GuiUpdateMessage of uuid and updates")
    return InnerParts(
        sockets=sockets,
        controls=_found(server.gui, "_gui_input_handle_from_uuid", "GuiApi"),
        connections=_found(sockets, "_live_connections", "WebsockServer"),
        update=update,
    )


def _found(thing: Any, name: str, of: str) -> Any:
    if not hasattr(thing, name):
        raise _moved(f"{of}.{name}")
    return getattr(thing, name)


def _moved(what: str) -> ViewerError:
    return ViewerError(
        f"viser {require_viser().__version__} has no {what}, by which the viewer filters what pages send; "
        "install another version with: pip install polypod[viewer]"
    )
