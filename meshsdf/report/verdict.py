"""What a report says first, in a sentence per method or comparison; written from its JSON."""

from ..mesh.topology import Topology
from .notation import count, place, written
from .pair_words import PairWords

METHOD_WORDS = {
    "marching-cubes": "marching cubes",
    "dual-contouring": "dual contouring",
    "surface-nets": "surface nets",
}
SIDES = {"forward": "of the mesh", "backward": "of what came back"}


def add_verdicts(data: dict) -> dict:
    """Return the report with its verdicts in words."""
    last = [data["rows"][index] for index in data["last_rows"]]
    sentences = [sentence(data["input"]["name"], row) for row in last]
    topology = [None if row["is_empty"] else topology_words(row["measures"]) for row in last]
    for row in data["rows"]:
        if not row["is_empty"]:
            row["measures"]["is_topology_kept"] = topology_words(row["measures"])["is_kept"]
    return data | {"verdict": {"sentences": sentences, "topology": topology}}


def sentence(name: str, row: dict) -> str:
    """Say how far, proved, where, and what became of topology and sharp edges."""
    how = f"from {written(row['resolution'], digits=6)} voxels by {METHOD_WORDS[row['method']]}"
    if row["is_empty"]:
        return f"Nothing of {name} comes back {how}: it is thinner than a voxel there."
    units = row["largest"]
    world, voxels, percent = (written(_upper(units[unit]), "up") for unit in units)
    worst = row[row["worst"]]
    least = written(worst["maximum"]["world"]["lower"], "down")
    parts = [
        f"{name}, brought back {how}, is nowhere farther than {world} ({voxels} voxels, "
        f"{percent} % of its diagonal) from its round trip, which is proved",
        f"the worst place is {place(worst['witness'])} on face {written(worst['source_face'])} "
        f"{SIDES[row['worst']]}, at least {least} away",
        topology_words(row["measures"])["sentence"],
    ]
    if row["sharp_edges"]:
        parts.append(sharp_words(row["sharp_edges"]))
    return "; ".join(parts) + "."


def comparison_verdict(told: dict, says: PairWords) -> dict:
    """Say in one sentence how far two surfaces are apart, proved, where, and what else differs."""
    voxels, percent = (written(_upper(told["largest"][u]), "up") for u in ("voxels", "percent"))
    others = [] if told["largest"]["voxels"] is None else [f"{voxels} voxels"]
    if told["largest"]["percent"] is not None:
        others.append(f"{percent} % of the diagonal of {says.a}")
    world = written(_upper(told["largest"]["world"]), "up")
    worst = told[told["worst"]]
    least = written(worst["maximum"]["world"]["lower"], "down")
    topology = topology_words(told["measures"], "is the same", "differs")
    parts = [
        f"No point of {says.a} or {says.b} is farther than {world}"
        f"{' (' if others else ''}{', '.join(others)}{')' if others else ''} from the other one, "
        "which is proved",
        f"the worst place is {place(worst['witness'])} on face {written(worst['source_face'])} "
        f"of {says.a if told['worst'] == 'forward' else says.b}, at least {least} away",
        topology["sentence"],
    ]
    if told["sharp_edges"]:
        unit = "world" if told["largest"]["voxels"] is None else "voxels"
        near = written(_upper(told["sharp_edges"]["largest"][unit]), "up")
        n = told["sharp_edges"]["n_edges"]
        whose = (
            f"the {written(n)} sharp edges of {says.a} are"
            if n > 1
            else f"the one sharp edge of {says.a} is"
        )
        within = near if unit == "world" else f"{near} voxels"
        parts.append(f"{whose} within {within} of {says.b}")
    told["measures"]["is_topology_kept"] = topology["is_kept"]
    return {"sentence": "; ".join(parts) + ".", "topology": topology}


def topology_words(measures: dict, same: str = "is kept", other: str = "is not kept") -> dict:
    """Whether the counts that make the topology are the same before and after, and which differ."""
    before, after = measures["before"], measures["after"]
    known = [
        (name, before[key], after[key])
        for name, key in (
            ("Euler number", "euler_number"),
            ("components", "n_components"),
            ("genus", "genus"),
            ("boundary loops", "n_boundary_loops"),
        )
        if before[key] is not None and after[key] is not None
    ]
    changes = [f"{name} {written(old)} → {written(new)}" for name, old, new in known if old != new]
    if changes:
        told = after.get("topology")
        rest = ""
        if told is not None and (by_index := Topology(**told)).differs:
            changes.append("counted by position")
            rest = f"; what came back is {by_index.describe()}"
        words = f"the topology {other} ({', '.join(changes)}){rest}"
        return {"is_kept": False, "sentence": words}
    facts = [
        f"Euler number {written(before['euler_number'])}",
        count(before["n_components"], "component"),
        count(before["n_boundary_loops"], "boundary loop"),
    ]
    return {"is_kept": True, "sentence": f"the topology {same} ({', '.join(facts)})"}


def sharp_words(edges: dict) -> str:
    """How near the sharp edges come back."""
    n, voxels = edges["n_edges"], written(_upper(edges["largest"]["voxels"]), "up")
    whose = f"its {written(n)} sharp edges come" if n > 1 else "its one sharp edge comes"
    return f"{whose} back within {voxels} voxels"


def _upper(span: dict | None) -> float | None:
    return None if span is None else span["upper"]
