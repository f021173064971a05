"""The core: owner of lines, samples, demands, guard and commands. Pure but for its shells."""
