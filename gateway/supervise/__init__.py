"""What the supervisor is made of: back-off, children that die with it, programs, notices to systemd."""
