"""The force law with memory that an FMU contains, and how the FMU is made."""
