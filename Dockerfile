# cdtool in a slim image, for a user that is not root:
#
#   docker build --tag cdtool --build-arg VERSION=0.1.0 .
#   docker run --rm --volume "$PWD:/data" --volume cdtool-cache:/cache --user "$(id -u)" cdtool benchmark benchmark.toml
#
# Reproducible: every package has its version and hash in docker/requirements.txt, compiled modules depend on content and
# not on times (SOURCE_DATE_EPOCH), and `docker buildx build --output type=image,rewrite-timestamp=true` sets the times of
# files. The base is pinned by its tag; for the same bytes give its digest: --build-arg BASE=python@sha256:...
ARG BASE=python:3.12.12-slim-bookworm

FROM ${BASE} AS build
ARG VERSION=0.1.0.dev0
ARG SOURCE_DATE_EPOCH=315532800
ENV SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH} \
    SETUPTOOLS_SCM_PRETEND_VERSION_FOR_CDTOOL=${VERSION} \
    PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_ROOT_USER_ACTION=ignore
WORKDIR /source
COPY docker/build.txt docker/
RUN pip install --require-hashes --only-binary :all: --requirement docker/build.txt
COPY pyproject.toml README.md LICENSE ./
COPY cdtool cdtool
RUN pip wheel --no-deps --no-build-isolation --wheel-dir /wheels .

FROM ${BASE}
ARG SOURCE_DATE_EPOCH=315532800
ENV PIP_NO_CACHE_DIR=1 PIP_DISABLE_PIP_VERSION_CHECK=1 PIP_ROOT_USER_ACTION=ignore
COPY docker/requirements.txt /tmp/
RUN SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH} pip install --require-hashes --only-binary :all: \
        --requirement /tmp/requirements.txt \
    && rm /tmp/requirements.txt
RUN --mount=type=bind,from=build,source=/wheels,target=/wheels \
    SOURCE_DATE_EPOCH=${SOURCE_DATE_EPOCH} pip install --no-deps --no-index /wheels/*.whl
# Any user may compile into the cache; a volume keeps it for the next container.
RUN useradd --uid 1000 --create-home cdtool && mkdir --mode 1777 /cache
ENV NUMBA_CACHE_DIR=/cache/numba MPLCONFIGDIR=/cache/matplotlib
USER 1000
WORKDIR /data
ENTRYPOINT ["cdtool"]
CMD ["--help"]
