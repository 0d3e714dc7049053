"""What an effect is, which are active, and what they do to rig and model; one file each in `library`."""
