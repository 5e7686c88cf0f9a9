"""The import doctor: findings on a log that would spoil an identification."""
