"""The whole gateway on emulated lines, compared with what physics allows. `benchmarks.line_limit` runs it."""
