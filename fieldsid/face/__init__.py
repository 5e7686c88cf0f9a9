"""The Python interface: every step of the command line as a function, on runs and models in memory or on disk.

`import fieldsid as fs` gives these functions by their names, see `fieldsid/__init__.py`. They take files, patterns, pandas tables
and records alike, use the same defaults as the commands, and return the records of the packages that they call.
"""
