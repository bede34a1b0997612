/* Runs of a model in lanes: behind lanes.h, the sizes, trial() and seen(); see lockstep.py. */
static void advance(int levels, const v *x, const v *held, v h, m active, v *out) {
  v later[NX], ok[1], step[1] = {h};
  trial(x, held, step, later, ok);
  const m bad = active & ~holds(ok[0]);
  if (levels && any(bad)) {
    v at[NX], next[NX];
    memcpy(at, x, sizeof at);
    for (int k = 0; k < FINER; k++) {
      advance(levels - 1, at, held, h / all(FINER), bad, next);
      memcpy(at, next, sizeof at);
    }
    for (int i = 0; i < NX; i++) later[i] = pick(bad, at[i], later[i]);
  }
  memcpy(out, later, sizeof later);
}

int lanes(void) { return LANES; }

/* runs[0..n) of all; x0 (NX, all), u (NU, all * length), d, p (NP, all), y (NY, all * length) */
void run(long long n, const long long *runs, long long length, const double *x0, const double *u,
         const double *d, const double *p, double *y) {
  for (long long first = 0; first < n; first += LANES) {
    long long at[LANES];
    v x[NX], held[NU + ND + NP + 1], out[NY], next[NX];
    for (int l = 0; l < LANES; l++) at[l] = runs[first + l < n ? first + l : n - 1];
    for (int i = 0; i < NX; i++) for (int l = 0; l < LANES; l++) x[i][l] = x0[at[l] * NX + i];
    v *const du = held, *const dd = held + NU, *const dp = held + NU + ND;
    for (int i = 0; i < NP; i++) for (int l = 0; l < LANES; l++) dp[i][l] = p[at[l] * NP + i];
    for (long long t = 0; t < length; t++) {
      if (t)
        for (int k = 0; k < STEPS; k++) {
          advance(LEVELS - 1, x, held, all(STEP_S), ~(m){0}, next);
          memcpy(x, next, sizeof x);
        }
      for (int i = 0; i < NU; i++)
        for (int l = 0; l < LANES; l++) du[i][l] = u[(at[l] * length + t) * NU + i];
      for (int i = 0; i < ND; i++)
        for (int l = 0; l < LANES; l++) dd[i][l] = d[(at[l] * length + t) * ND + i];
      seen(x, du, dd, dp, out);
      for (int l = 0; l < LANES && first + l < n; l++)
        for (int i = 0; i < NY; i++) y[(at[l] * length + t) * NY + i] = out[i][l];
    }
  }
}
