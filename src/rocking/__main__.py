"""The program `rocking`: an interrupt while the command line is being imported ends it as one later does."""

import gc
import sys


def main() -> None:
    """Run the command line, as `rocking.cli.main` does."""
    try:
        from rocking.cli import main as run

        run()
    except KeyboardInterrupt:
        from rocking.errors import INTERRUPTED

        print(INTERRUPTED, file=sys.stderr)
        sys.exit(130)
    finally:
        # As Python ends it looks for cycles among all objects, again and again: up to a second, for memory that is
        # given back anyway.
        gc.freeze()


if __name__ == "__main__":
    main()
