"""What a user writes: the parts of a mechanism as frozen records that refer to each other by name."""
