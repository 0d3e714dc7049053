"""The force law with memory that an FMU carries, how it is found, and how the FMU is made."""
