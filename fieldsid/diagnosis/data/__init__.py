"""What a diagnosis is made from: the hold-out, the applicable effects, the noise floor."""
