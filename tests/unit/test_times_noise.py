"""An error over the noise in words: a factor where there is noise, and no factor where the log has none to speak of."""

from fieldsid.rounding import noise_fall, times_noise


def test_a_factor_is_said_of_a_log_with_noise_only():
    assert times_noise(1.043) == "1.04 x the noise"
    assert times_noise(99.9, "the noise floor on unseen data") == "99.90 x the noise floor on unseen data"
    assert times_noise(26370.0) == "far more than the noise, of which the log has next to none"


def test_a_fall_is_said_in_factors_as_long_as_there_is_noise():
    assert noise_fall(3.2, 1.04) == "3.20 to 1.04 x the noise floor"
    assert (
        noise_fall(26370.0, 1.5) == "far more than the noise floor, of which the log has next to none, to 1.50 x the noise floor"
    )
