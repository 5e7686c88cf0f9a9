"""From models at a few speeds to radius and measured circles."""
