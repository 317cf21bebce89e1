"""What the command line of every command uses: options, streams, tables and progress."""
