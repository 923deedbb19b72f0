"""Which layers an operation looks at, changes or takes away, so that painters are not disturbed."""

from .history import Step
from .journal import Project
from .operations import TURNS, Operation

WITHOUT_TEXELS = ("add-layer", "layer")
"""Kinds of operations that leave all texels as they are."""

ONE_LAYER = (
    "bake", "coarsen", "drop-layer", "fill-color", "mesh-colors", "paint-ball", "project", "stroke",
)  # fmt: skip
"""Kinds that look at no texels but those of their layer, and change no others."""


def layers_touched(project: Project, operation: Operation) -> set[int]:
    """Numbers of the layers whose texels an operation may read or change."""
    if operation.kind in WITHOUT_TEXELS:
        return set()
    if operation.kind in ONE_LAYER:
        return {operation.layer}
    step = _step(project, operation)
    if operation.kind in TURNS and (step is None or step.change is not None):
        return {one.layer.number for one in step.change.slots} if step else set()
    # An unknown kind, or a step that is found again by doing everything before it
    return {layer.number for layer in project.texture.layers}


def layers_going(project: Project, operation: Operation) -> set[int]:
    """Numbers of the layers that will be gone after an operation, or may be."""
    here = {layer.number for layer in project.texture.layers}
    if operation.kind == "drop-layer":
        return here & {operation.layer}
    step = _step(project, operation)
    if step is None:
        return set()
    if step.change is not None:
        after = step.change.before if operation.kind == "undo" else step.change.after
        return here - {state.layer.number for state in after.layers}
    return here if step.name in ("add-layer", "drop-layer") else set()


def _step(project: Project, operation: Operation) -> Step | None:
    """What an operation undoes or redoes, if it does that."""
    history = project.history
    index = history.n_done - (operation.kind == "undo")
    is_there = operation.kind in TURNS and 0 <= index < len(history.steps)
    return history.steps[index] if is_there else None
