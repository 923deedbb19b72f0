"""meshsdf.texture.live: several clients together, held against the journal done from its start."""

import shutil

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from meshsdf.errors import TextureError
from meshsdf.texture.journal import Project
from meshsdf.texture.live import LiveStrokes
from meshsdf.texture.operations import Operation
from tests.texture.live_twin import (
    ANNE,
    BERT,
    BRUSHES,
    CLIENTS,
    RED,
    ball,
    crashed,
    fresh,
    operations_of,
    replayed,
    samples_of,
    walk,
)


def test_operations_of_others_find_the_layer_without_the_stroke_that_goes_on(tmp_path):
    live = fresh(tmp_path)
    rng = np.random.default_rng(4)
    live.begin(ANNE, 1, 0, BRUSHES["clone"])
    live.add(ANNE, 2, *walk(rng, 3))
    bake = {"layer": 0, "texture_kind": "checker", "side": 0.4, "level": 1}
    for n, operation in enumerate(
        [
            Operation("bake", bake),
            Operation("undo"),
            Operation("redo"),
            ball(0, 2.0),
            ball(1, 3.0),
            Operation("undo"),
            Operation("layer", {"layer": 0, "opacity": 0.5, "place": 1}),
            Operation("add-layer", {}),
            Operation("coarsen", {"layer": 0}),
            Operation("undo"),
            Operation("undo"),
            Operation("undo"),
            Operation("fill-color", {"layer": 0, "color": [0.9, 0.9, 0.1]}),
        ]
    ):
        live.apply(operation, client=BERT, cseq=n + 1)
        live.add(ANNE, 3 + n, *walk(rng, 2))
    live.end(ANNE, 100)
    digest = live.project.digest()
    live.apply(Operation("undo"))
    live.apply(Operation("redo"))
    assert live.project.digest() == digest
    live.close()
    assert replayed(tmp_path / "a.mtex") == digest
    with Project.open(tmp_path / "a.mtex") as project:
        assert project.digest() == digest


def test_a_layer_does_not_go_while_somebody_paints_on_it(tmp_path):
    live = fresh(tmp_path)
    live.apply(Operation("add-layer"))
    live.begin(ANNE, 1, 2, BRUSHES["band"])
    live.add(ANNE, 2, *walk(np.random.default_rng(0), 3))
    shown = live.project.digest()
    for operation in (Operation("drop-layer", {"layer": 2}), Operation("undo")):
        with pytest.raises(TextureError, match=f"client '{ANNE}' is painting on layer 2"):
            live.apply(operation, client=BERT, cseq=1)
    live.apply(Operation("drop-layer", {"layer": 1}))
    live.apply(Operation("undo"))
    assert live.project.digest() == shown
    live.end(ANNE, 3)
    live.apply(Operation("drop-layer", {"layer": 2}), client=BERT, cseq=1)
    live.apply(Operation("undo"))
    live.begin(ANNE, 4, 2, BRUSHES["band"])
    with pytest.raises(TextureError, match="is painting on layer 2"):
        live.apply(Operation("redo"))
    live.close()
    # After opening, what a step changed is not known
    live = LiveStrokes.open(tmp_path / "a.mtex")
    while live.project.history.names[-1] != "add-layer":
        live.apply(Operation("undo"))
    live.begin(ANNE, 6, 0, BRUSHES["band"])
    if live.project.history.steps[live.project.history.n_done - 1].change is None:
        with pytest.raises(TextureError, match="is painting on layer 0"):
            live.apply(Operation("undo"))
    live.close()


class Model:
    """Three clients who do what dice say; what was promised to them."""

    def __init__(self, folder, seed):
        self.folder, self.rng = folder, np.random.default_rng(seed)
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        # With little memory, undoing is doing everything before again
        self.live = fresh(folder, budget=int(self.rng.choice([20_000, 2**29])))
        self.cseq = dict.fromkeys(CLIENTS, 0)
        self.open = {}  # client to layer and batches
        self.promised = []  # client and samples of strokes that ended

    def step(self):
        client = str(self.rng.choice(CLIENTS))
        dice = self.rng.random()
        if dice < 0.08:
            self.operation(client)
        elif dice < 0.12:
            self.crash()
        elif client not in self.open:
            self.begin(client)
        elif dice < 0.2:
            self.live.cancel(client, self.next(client))
            del self.open[client]
        elif dice < 0.4:
            self.live.end(client, self.next(client))
            self.promised.append((client, self.open.pop(client)))
        else:
            batch = walk(self.rng, int(self.rng.integers(1, 4)))
            self.live.add(client, self.next(client), *batch)
            self.open[client].append(np.column_stack(batch))

    def next(self, client):
        self.cseq[client] += int(self.rng.integers(1, 3))
        return self.cseq[client]

    def begin(self, client):
        layers = [layer.number for layer in self.live.project.texture.layers]
        brush = BRUSHES[str(self.rng.choice(["band", "dabs", "erase", "smudge", "clone"]))]
        self.live.begin(client, self.next(client), int(self.rng.choice(layers)), brush)
        self.open[client] = []

    def operation(self, client):
        layers = [layer.number for layer in self.live.project.texture.layers]
        layer = int(self.rng.choice(layers))
        choices = [
            Operation("undo"), Operation("redo"), ball(layer, self.rng.uniform(0, 6)),
            Operation("layer", {"layer": layer, "opacity": 0.5}), Operation("add-layer"),
            Operation("drop-layer", {"layer": layer}),
            Operation("fill-color", {"layer": layer, "color": RED}),
        ]  # fmt: skip
        operation = choices[int(self.rng.integers(len(choices)))]
        if operation.kind == "drop-layer" and len(layers) == 1:
            return
        history = self.live.project.history
        if operation.kind == "undo" and history.n_done < 5:  # the layers of the beginning
            return
        cseq, before = self.cseq[client] + 1, self.live.project.digest()
        refused = None
        try:
            self.live.apply(operation, client=client, cseq=cseq)
        except TextureError as error:
            refused = error.what
        if refused is None:
            self.cseq[client] = cseq
        else:
            assert "is painting on" in refused or "nothing to" in refused
            assert self.live.project.digest() == before

    def crash(self):
        shown = self.live.project.digest()
        path = crashed(self.live, self.folder / "copy")
        self.live.project.close()
        for end in ("-wal", "-lock"):
            (self.folder / f"a.mtex{end}").unlink(missing_ok=True)
        for end in ("", "-wal", "-lock"):
            shutil.copyfile(f"{path}{end}", f"{self.folder}/a.mtex{end}")
        words = []
        self.live = LiveStrokes.open(self.folder / "a.mtex", warn=words.append)
        assert not words
        assert set(self.live.open_clients()) == set(self.open)
        assert self.live.project.digest() == shown
        assert all(self.live.last_cseq(client) == self.cseq[client] for client in self.open)

    def check(self):
        self.live.finish_all()
        self.promised += list(self.open.items())
        digest = self.live.project.digest()
        self.live.close()
        path = self.folder / "a.mtex"
        assert replayed(path) == digest
        strokes = [(c, o) for c, _, o in operations_of(path) if o.kind == "stroke"]
        for client in CLIENTS:
            kept = [samples_of(operation) for other, operation in strokes if other == client]
            promised = [batches for other, batches in self.promised if other == client]
            assert len(kept) == len(promised)
            for one, batches in zip(kept, promised, strict=True):
                np.testing.assert_array_equal(one, np.concatenate([np.empty((0, 7)), *batches]))
        with Project.open(path) as project:
            assert project.digest() == digest


@settings(max_examples=5)
@given(seed=st.integers(0, 10**6))
def test_whatever_clients_do_the_journal_tells_what_is_seen(tmp_path_factory, seed):
    model = Model(tmp_path_factory.mktemp("model"), seed)
    for _ in range(30):
        model.step()
    model.check()
