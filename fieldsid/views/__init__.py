"""How each kind of record is shown: one file per class of records with its `VIEW`, found by the registry; see `fieldsid.display`.

A file here imports neither a room of the package nor pandas or matplotlib before it is asked for what needs them: whoever
prints one record does not load the others' rooms.
"""
