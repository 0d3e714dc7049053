"""Path-dependent branches, one file each."""
