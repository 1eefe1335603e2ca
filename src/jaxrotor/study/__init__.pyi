from .study import Study as Study, load as load
