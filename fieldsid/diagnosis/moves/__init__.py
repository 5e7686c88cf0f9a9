"""The moves of a search: each adds, drops or changes one part of a model, and is fitted and scored under the same conditions."""
