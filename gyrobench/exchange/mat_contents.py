"""A program of its own that reads a .mat file: scipy's reader may end its process where the file is damaged.

python mat_contents.py FILE BYTES: the variables to standard output, as a pickle; code 3 where the arrays together are
larger than that, 1 with the reason where the file cannot be read.
"""

import pickle
import sys

import numpy as np
from scipy.io import loadmat, whosmat

TOO_LARGE = 3


def main() -> None:
    file, most = sys.argv[1], float(sys.argv[2])
    try:
        if 8 * sum(int(np.prod([float(n) for n in shape])) for _, shape, _ in whosmat(file)) > most:
            sys.exit(TOO_LARGE)
        content = loadmat(file, chars_as_strings=False)
    except Exception as error:  # of any kind, where the file is damaged
        sys.exit(str(error)[:200] or type(error).__name__)
    pickle.dump({n: v for n, v in content.items() if not n.startswith("__")}, sys.stdout.buffer, protocol=5)


if __name__ == "__main__":
    main()
