"""What shows the gateway to the world: a folder and a process for each protocol."""
