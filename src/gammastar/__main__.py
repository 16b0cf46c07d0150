"""`python -m gammastar` is the command `gammastar`."""

import sys

from gammastar.cli import main

if __name__ == "__main__":
    sys.exit(main())
