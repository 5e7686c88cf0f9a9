"""The mapping of columns and topics to signals: names, their meaning, and the mapping file."""
