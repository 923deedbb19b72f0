"""meshsdf.texture.spill: bytes in memory and in a file without a name, and disks that are full."""

import gc
import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from meshsdf.texture.spill import Spill


@given(st.integers(0, 2**32), st.sampled_from([0, 500, 10**9]))
def test_bytes_are_what_they_were_and_room_is_used_again(seed, memory):
    dice, spill, kept = np.random.default_rng(seed), Spill(memory=memory), {}
    most = 0
    for _ in range(120):
        if kept and dice.random() < 0.5:
            number = list(kept)[dice.integers(len(kept))]
            del kept[number]
            spill.free(number)
        else:
            data = dice.bytes(int(dice.integers(0, 300)))
            kept[spill.put(data)] = data
        most = max(most, sum(map(len, kept.values())))
        assert spill.n_in_memory + spill.n_in_file == sum(map(len, kept.values()))
        assert spill.n_in_memory <= memory
        assert all(spill.get(number) == data for number, data in kept.items())
    if spill._file is not None:
        assert os.fstat(spill._file.fileno()).st_size <= 2 * most
    for number in list(kept):
        spill.free(number)
    if spill._file is not None:
        assert os.fstat(spill._file.fileno()).st_size == 0
    spill.close()


def test_the_file_is_closed_with_the_spill_or_when_nobody_has_it():
    for forget in (False, True):
        spill = Spill(memory=0)
        spill.put(b"abc")
        descriptor = spill._file.fileno()
        os.fstat(descriptor)
        if forget:
            del spill
            gc.collect()
        else:
            spill.close()
            spill.close()
        with pytest.raises(OSError, match="Bad file descriptor"):
            os.fstat(descriptor)


PROGRAM = """
import sys, time
from meshsdf.texture.spill import Spill
spill = Spill(memory=0)
spill.put(b"x" * 100_000)
print("ready", flush=True)
time.sleep(60)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="processes are not killed here")
def test_nothing_is_left_when_the_process_is_killed(tmp_path):
    command, room = [sys.executable, "-c", PROGRAM], os.environ | {"TMPDIR": str(tmp_path)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, env=room, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        links = [os.readlink(one) for one in Path(f"/proc/{process.pid}/fd").iterdir()] if (
            sys.platform == "linux") else [str(tmp_path)]  # fmt: skip
        process.send_signal(signal.SIGKILL)
        process.wait()
    assert any(link.startswith(str(tmp_path)) for link in links)
    assert list(tmp_path.iterdir()) == []


FULL = """
import resource, signal
from meshsdf.texture.history import History
from meshsdf.texture.content import digest
from meshsdf.texture.spill import Spill
from meshsdf.texture.volume_texture import VolumeTexture
from meshsdf.mesh import icosphere
import numpy as np

signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
resource.setrlimit(resource.RLIMIT_FSIZE, (30_000, resource.RLIM_INFINITY))
texture = VolumeTexture.around(icosphere(subdivisions=2), resolution=48)
layer = texture.add_layer()
history = History(texture, dense=0, budget=400_000)
history.spill = Spill(memory=0)
entries = np.arange(40, dtype=np.int32)
n = int(np.diff(texture.octree.tables.texel_first)[entries].sum())
digests = [digest(texture)]
for number in range(30):
    values = np.random.default_rng(number).random((n, 4)).astype(np.float32)
    with history.record("stroke"):
        texture.put(layer, entries, values)
    digests.append(digest(texture))
    while history.put_some_by():
        pass
assert 0 < history.spill.n_in_file <= 30_000 < history.spill.n_in_memory
assert history.n_bytes <= 400_000
kept = sum(step.change is not None for step in history.steps)
assert 5 < kept < 30, kept
for number in range(kept):
    history.undo()
    assert digest(texture) == digests[29 - number]
print("whole")
"""


@pytest.mark.skipif(sys.platform != "linux", reason="files are limited otherwise here")
def test_what_a_full_disk_does_not_take_stays_in_memory_within_the_budget():
    done = subprocess.run(
        [sys.executable, "-c", FULL], capture_output=True, text=True, timeout=300, check=False
    )
    assert (done.stdout, done.returncode) == ("whole\n", 0), done.stderr
