"""``python -m gyrobench``: the commands, where no ``gyrobench`` is on the path."""

from gyrobench.commands.cli import main

if __name__ == "__main__":
    main()
