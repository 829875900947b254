"""The command `drt`, which the package carries: `drt render scene.xml`, or `python -m drt render scene.xml`."""

import signal
import sys

from . import _core


def main() -> int:
    """Runs the command line, and returns its exit code."""
    # The command writes what is finished when it is stopped, which Python's own handler would not let it do.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return _core.main(["drt", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
