"""The commands, one thin file each: parse the arguments, call the package, print the result."""
