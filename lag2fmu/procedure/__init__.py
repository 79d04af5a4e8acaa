"""What people read: the steps of the textbook procedure filled in, and equations as formulas."""
