"""The command `atomesh`, which is in the extension: its code is there once."""

import sys

from ._atomesh import run_command


def main() -> None:
    """Runs the command with the process's arguments."""
    sys.exit(run_command(["atomesh", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
