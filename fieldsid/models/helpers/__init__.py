"""What a hull does beside the motion of an axis: its surge without noise, its drift law, and drag along its length."""
