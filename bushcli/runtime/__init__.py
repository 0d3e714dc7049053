"""What every command stands on: conditions, checks of the installation, interrupts, processes, kept work."""
