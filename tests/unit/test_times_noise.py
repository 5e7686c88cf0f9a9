"""An error over the noise in words: a factor where there is noise, and no factor where the log has none to speak of."""

from fieldsid.rounding import times_noise


def test_a_factor_is_said_of_a_log_with_noise_only():
    assert times_noise(1.043) == "1.04 x the noise"
    assert times_noise(99.9, "the noise floor on unseen data") == "99.90 x the noise floor on unseen data"
    assert times_noise(26370.0) == "far more than the noise, of which the log has next to none"
