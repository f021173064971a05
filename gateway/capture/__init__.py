"""Wire traces as files: frames of a line as text and as pcapng, written and read again. Pure."""
