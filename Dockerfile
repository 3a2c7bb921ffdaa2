# docker build -t mrdamper . && docker run --rm -v "$PWD:/data" mrdamper study /data/rig --out /data/result
FROM python:3.11-slim AS build
WORKDIR /src
COPY . .
ARG SOURCE_DATE_EPOCH=0
RUN PIP_CONSTRAINT=constraints.txt python -m pip wheel --no-deps --wheel-dir /dist .

FROM python:3.11-slim
COPY release/lock.txt /tmp/lock.txt
COPY --from=build /dist/*.whl /tmp/
RUN python -m pip install --no-cache-dir --require-hashes -r /tmp/lock.txt \
 && python -m pip install --no-cache-dir --no-deps /tmp/*.whl \
 && rm /tmp/lock.txt /tmp/*.whl \
 && useradd --create-home damper
USER damper
WORKDIR /data
ENTRYPOINT ["mrdamper"]
CMD ["--help"]
