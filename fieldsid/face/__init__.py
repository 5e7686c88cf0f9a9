"""The Python face: every step of the command line as a function with the same arguments, on runs and models in memory or on disk.

`import fieldsid as fs` gives these functions by their names, see `fieldsid/__init__.py`. They take files, patterns, pandas tables
and records alike, fill in what a command fills in, and return the records that the rooms below make.
"""
