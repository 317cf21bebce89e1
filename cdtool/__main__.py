"""`python -m cdtool`: the command line of this interpreter's cdtool, also where `cdtool` is not on the path."""

from cdtool.cli.app import main

if __name__ == "__main__":
    main()
