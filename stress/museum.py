"""A thousand motions by a thousand blocks by ten scales, from a file to fragility curves in two commands; killed twice.

python stress/museum.py --motions 1000 --blocks 1000
"""

import argparse
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import rocking

ROCKING = [sys.executable, "-c", "from rocking.cli import main; main()"]

FILE = """\
[blocks]
p = "1.5:6:{p}"
alpha = "5deg:20deg:25"
restitution = 0.9

[motions]
records = {records}

[[motions.pulses]]
family = "one_sine"
amplitude = 1.0
frequency = "0.3:5:{sines}:log"

[[motions.pulses]]
family = "ricker"
amplitude = 1.0
frequency = "0.3:5:{rickers}:log"

[scales]
pga = "0.1g:1.5g:10"

[simulation]
model = "linear"

[report.fragility]
measure = "pga"
limits = {{ overturning = inf, half = 0.5 }}
blocks = "{whose}"
"""


def main() -> None:
    """Run the two commands, the first killed twice on the way."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--motions", type=int, default=1000)
    parser.add_argument("--blocks", type=int, default=1000)
    parser.add_argument("--whose", default="each", help="a curve for each block, or one for all together")
    given = parser.parse_args()
    records = [name for name in rocking.records.names() if not name.endswith("up")]
    rest = given.motions - len(records)
    with tempfile.TemporaryDirectory() as where:
        file = Path(where) / "museum.toml"
        shape = {"p": given.blocks // 25, "sines": rest // 2, "rickers": rest - rest // 2, "whose": given.whose}
        file.write_text(FILE.format(records=str(records).replace("'", '"'), **shape))
        folder = Path(where) / "museum"
        start = time.monotonic()
        for share in (0.3, 0.6):
            with subprocess.Popen([*ROCKING, "study", "run", str(file)], stdout=subprocess.DEVNULL) as process:
                while _done(folder) < share and process.poll() is None:
                    time.sleep(0.2)
                process.send_signal(signal.SIGKILL)
            print(f"killed at {100 * _done(folder):.0f} % after {time.monotonic() - start:.0f} s", flush=True)
        for command in (["study", "run", str(file)], ["study", "report", str(folder)]):
            begun = time.monotonic()
            out = subprocess.run([*ROCKING, *command], stdout=subprocess.PIPE, text=True, check=True).stdout
            print(f"rocking {' '.join(command[:2])}: {time.monotonic() - begun:.0f} s\n{out}", flush=True)
        print(f"all of it: {time.monotonic() - start:.0f} s")


def _done(folder: Path) -> float:
    """Share of the units that are done."""
    if not (folder / "study.json").exists():
        return 0.0
    status = rocking.study(folder).status
    return status.done / status.units


if __name__ == "__main__":
    main()
