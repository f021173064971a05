"""What the commands share: finding a site and its core, reading words from people, writing answers."""
