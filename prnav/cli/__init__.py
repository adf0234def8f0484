"""The commands: thin layers that parse, call and print."""
