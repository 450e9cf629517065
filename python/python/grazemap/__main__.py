"""Program `grazemap`, compiled into the module: ``python -m grazemap``."""

import sys

from . import _lib


def main() -> None:
    """Run the program on the arguments of the process."""
    sys.exit(_lib.program(["grazemap", *sys.argv[1:]]))


if __name__ == "__main__":
    main()
