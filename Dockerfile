# The gateway as an image: built in one stage, run in another, as a user without rights.
#
#   docker build -t drive-gateway .
#   docker run --device /dev/serial/by-id/usb-FTDI_A1:/dev/ttyUSB0 --group-add dialout \
#     -v ./site:/site -p 4840:4840 --read-only --tmpfs /tmp --cap-drop ALL drive-gateway
#
# /site holds site.yaml; what the gateway keeps goes to its `data:` folder, so make that writable for
# user 10001. The serial device needs the group that owns it on the host (dialout on Debian).

FROM python:3.11-slim AS build
WORKDIR /src
COPY . .
RUN python -m venv /opt/gateway
RUN /opt/gateway/bin/python -m pip install --no-cache-dir --require-hashes -r requirements/dev.txt
RUN /opt/gateway/bin/python -m pip wheel --no-deps --no-build-isolation --wheel-dir dist .
RUN python -m venv --clear /opt/gateway
RUN /opt/gateway/bin/python -m pip install --no-cache-dir --require-hashes -r requirements/runtime.txt
RUN /opt/gateway/bin/python -m pip install --no-cache-dir --no-deps --no-index --find-links dist drive-gateway

FROM python:3.11-slim
RUN useradd --uid 10001 --no-create-home --shell /usr/sbin/nologin gateway
COPY --from=build /opt/gateway /opt/gateway
USER 10001
WORKDIR /site
ENV PATH=/opt/gateway/bin:$PATH PYTHONUNBUFFERED=1 XDG_RUNTIME_DIR=/tmp
EXPOSE 4840
STOPSIGNAL SIGTERM
HEALTHCHECK --interval=30s --timeout=5s --start-period=20s CMD ["gateway", "health", "/site/site.yaml"]
ENTRYPOINT ["gateway"]
CMD ["run", "/site/site.yaml"]
