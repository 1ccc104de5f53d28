# The package as it is installed on Debian 12:
#   docker build -t pf_resampling . && docker run --rm -it pf_resampling
FROM debian:12 AS build
COPY . /src/pf_resampling
WORKDIR /src/pf_resampling
RUN apt-get update && apt-get install -y --no-install-recommends build-essential && \
    apt-get build-dep -y --no-install-recommends . && dpkg-buildpackage --no-sign --build=binary

FROM debian:12
COPY --from=build /src/libpf-resampling0.2_*.deb /src/pf-resampling_*.deb /tmp/
RUN apt-get update && apt-get install -y --no-install-recommends /tmp/*.deb && \
    rm -r /tmp/*.deb /var/lib/apt/lists/* && useradd --create-home user
USER user
WORKDIR /home/user
CMD ["bash"]
