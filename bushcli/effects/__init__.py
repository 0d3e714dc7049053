"""The type of an effect, the active effects of a case, and their changes to rig and model."""
