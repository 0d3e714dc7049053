"""A diagnosis -> its document (`document`), with its sentences, its paragraph and its values."""
