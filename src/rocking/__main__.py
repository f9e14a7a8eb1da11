"""The program `rocking`: an interrupt while the command line is being imported ends it as one later does."""

import sys


def main() -> None:
    """Run the command line, as `rocking.cli.main` does."""
    try:
        from rocking.cli import main as run
    except (KeyboardInterrupt, RuntimeError) as error:
        # Python 3.11 makes an error of its own of what interrupts it while it makes a class.
        if not isinstance(error, KeyboardInterrupt) and not isinstance(error.__cause__, KeyboardInterrupt):
            raise
        from rocking.errors import INTERRUPTED

        print(INTERRUPTED, file=sys.stderr)
        sys.exit(130)
    run()


if __name__ == "__main__":
    main()
