"""An emulated RS-485 line with true timing, as a process of its own. It shares no code with the gateway.

A pty hands bytes over at once; here they cross a wire that takes its time. A frame's first bit is on the wire
when the bytes arrive or when the wire becomes free, whichever is later, and its last bit so many characters
after that. A drive begins its reply one turnaround later, and the reply is handed over when its last bit has
crossed. A request that begins before the mandatory silence is over is counted, and nobody answers it.
"""
