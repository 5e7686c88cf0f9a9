"""What the numbers of a log say of it: which signals they are, in which unit, from where they count."""
