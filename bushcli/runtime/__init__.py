"""Services for every command: conditions, checks of the installation, interrupts, processes, saved results."""
