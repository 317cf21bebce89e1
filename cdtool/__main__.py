"""The program `cdtool`, also as `python -m cdtool`, where `cdtool` is not on the path."""

import signal


def main() -> None:
    """Run the command line. Ctrl-C while its modules are imported ends the process at once, without a traceback.

    Before this line Python itself starts, for some 20 ms, in which Ctrl-C shows a traceback of its own.
    """
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from cdtool.commands.app import main as run

    run()


if __name__ == "__main__":
    main()
