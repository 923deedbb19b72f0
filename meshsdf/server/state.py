"""What pages know of a project besides its bricks: layers, steps, who paints."""

from collections.abc import Mapping
from typing import Any

from ..texture.journal import Project
from ..texture.layer import Layer
from ..texture.procedural_layer import ProceduralLayer

MOST_STEPS = 200


def state_of(project: Project, clients: Mapping[int, str], n_painters: int) -> dict[str, Any]:
    """What STATE says; see `PROTOCOL.md`.

    Parameters
    ----------
    project : Project
    clients : mapping of int to str
        Who did the operation of a number.
    n_painters : int
        Pages that are connected.
    """
    history = project.history
    steps = [
        {"name": step.name, "client": clients.get(step.number, ""), "seq": step.number}
        for step in history.steps[max(0, history.n_done - MOST_STEPS) :][: 2 * MOST_STEPS]
    ]
    n_done = min(history.n_done, MOST_STEPS)
    return {
        "seq": project.last_seq,
        "saved": project.last_seq,
        "layers": [_layer(layer) for layer in project.texture.layers],
        "history": {"done": steps[:n_done], "undone": steps[n_done : n_done + MOST_STEPS]},
        "painters": n_painters,
    }


def _layer(layer: Layer) -> dict[str, Any]:
    is_procedural = isinstance(layer, ProceduralLayer) and layer.function is not None
    return {
        "number": layer.number,
        "name": layer.name,
        "opacity": float(layer.opacity),
        "mode": layer.mode,
        "visible": bool(layer.visible),
        "kind": "procedural" if is_procedural else "paint",
    }
