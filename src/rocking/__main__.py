"""The program `rocking`: an interrupt while the command line is being imported ends it as one later does."""

import sys


def main() -> None:
    """Run the command line, as `rocking.cli.main` does."""
    try:
        from rocking.cli import main as run
    except KeyboardInterrupt:
        from rocking.errors import INTERRUPTED

        print(INTERRUPTED, file=sys.stderr)
        sys.exit(130)
    run()


if __name__ == "__main__":
    main()
