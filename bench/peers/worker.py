"""worker.py PEER FOLDER THREADS PRECISION: a peer's process. It speaks as clarus_turn does: JSON, a line each.

The first line says what runs, and how far its outputs are from PyTorch's, or why there is nothing to run; then every
"frame" on standard input is answered with the seconds that a run took.
"""

import json
import os
import sys
import time
from pathlib import Path

import numpy as np

from compare import difference


def main(peer, folder, threads, precision):
    answers = os.fdopen(os.dup(1), "w", buffering=1)
    os.dup2(2, 1)  # what frameworks print is no answer

    def say(**answer):
        print(json.dumps(answer), file=answers)

    try:
        import frameworks

        inputs, expected = (dict(np.load(folder / f"{name}.npz")) for name in ("inputs", "outputs"))
        runner = frameworks.PEERS[peer](folder, inputs, list(expected), threads, precision)
        runner.run()
    except Exception as error:  # whatever it is, the table has to say it
        return say(error=f"{type(error).__name__}: {error}"[:300])
    actual = runner.outputs()
    way = getattr(runner, "way", None)
    say(version=runner.version, way=way, difference=difference([(actual[name], expected[name]) for name in expected]))
    del actual, expected  # NSRR's are half a gigabyte
    for _ in sys.stdin:
        start = time.perf_counter()
        runner.run()
        say(seconds=time.perf_counter() - start)


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), sys.argv[4])
