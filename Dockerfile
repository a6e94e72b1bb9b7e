# The program in a container: docker build -t rig . && docker run --rm -v "$PWD:/data" rig inspect log.csv
# No test builds this file; the script that it calls is tested.
FROM rust:1-bookworm AS build
WORKDIR /rig
COPY . .
RUN host/rig/static && cp target/x86_64-unknown-linux-musl/release/rig /usr/local/bin/rig

FROM debian:bookworm-slim
COPY --from=build /usr/local/bin/rig /usr/local/bin/rig
WORKDIR /data
ENTRYPOINT ["rig"]
