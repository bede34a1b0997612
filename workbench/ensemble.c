/* Runs of a model in lanes, each at its own pace: behind lanes.h, the sizes, trial() and seen(). */
typedef struct {
  const double *x0, *u, *d, *p; /* (NX, runs), (NU, runs * length), (ND, ...), (NP, runs) */
  double *y;                    /* (NY, runs * length) */
  long long runs, length;
} asked;

typedef struct {
  v x[NX], held[NU + ND + NP + 1], h[1];
} points;

/* What a lane works on: a run, none below 0; left[k] steps of level k are still to be done. */
typedef struct {
  long long run, sample;
  int level, left[LEVELS];
  double *states; /* (NX, length) of its run */
} lane;

static void hold(const asked *a, long long at, int l, v *held) {
  for (int i = 0; i < NU; i++) held[i][l] = a->u[at * NU + i];
  for (int i = 0; i < ND; i++) held[NU + i][l] = a->d[at * ND + i];
}

static void begin(const asked *a, points *now, int l, lane *own) {
  for (int i = 0; i < NX; i++) own->states[i] = now->x[i][l] = a->x0[own->run * NX + i];
  for (int i = 0; i < NP; i++) now->held[NU + ND + i][l] = a->p[own->run * NP + i];
  hold(a, own->run * a->length, l, now->held);
  now->h[0][l] = STEP_S;
  own->sample = own->level = 0;
  own->left[0] = STEPS;
}

/* True where the step is taken: its error passes, or no finer one is left. */
static int taken(double passes, points *now, int l, lane *own) {
  if (passes != 0 || own->level == LEVELS - 1) return 1;
  own->left[++own->level] = FINER;
  now->h[0][l] /= FINER;
  return 0;
}

/* Behind a step that is taken: true where the run is at its end. */
static int ended(const asked *a, points *now, int l, lane *own) {
  while (--own->left[own->level] == 0 && own->level) {
    own->level--;
    now->h[0][l] *= FINER;
  }
  if (own->left[0]) return 0;
  own->left[0] = STEPS;
  double *const states = own->states + ++own->sample * NX;
  for (int i = 0; i < NX; i++) states[i] = now->x[i][l];
  if (own->sample + 1 == a->length) return 1;
  hold(a, own->run * a->length + own->sample, l, now->held);
  return 0;
}

/* Outputs of a run whose states are known, several samples side by side. */
static void show(const asked *a, const lane *own) {
  v x[NX], held[NU + ND + NP + 1], out[NY];
  const double *const p = a->p + own->run * NP;
  const long long first = own->run * a->length;
  for (int i = 0; i < NP; i++) held[NU + ND + i] = all(p[i]);
  for (long long s = 0; s < a->length; s += LANES) {
    for (int l = 0; l < LANES; l++) {
      const long long at = s + l < a->length ? s + l : a->length - 1;
      for (int i = 0; i < NX; i++) x[i][l] = own->states[at * NX + i];
      hold(a, first + at, l, held);
    }
    seen(x, held, held + NU, held + NU + ND, out);
    for (int l = 0; l < LANES && s + l < a->length; l++)
      for (int i = 0; i < NY; i++) a->y[(first + s + l) * NY + i] = out[i][l];
  }
}

/* The next run that nobody has taken; false where there is none.  One of one sample ends at once. */
static int next(const asked *a, points *now, int l, lane *own, long long *taken_runs) {
  for (;;) {
    own->run = __atomic_fetch_add(taken_runs, 1, __ATOMIC_RELAXED);
    if (own->run >= a->runs) own->run = -1;
    if (own->run < 0) return 0;
    begin(a, now, l, own);
    if (a->length > 1) return 1;
    show(a, own);
  }
}

int lanes(void) { return LANES; }

/* Threads that share `taken_runs` share the runs; states (NX, length, lanes) are a thread's own. */
void run(long long runs, long long length, int lanes, const double *x0, const double *u,
         const double *d, const double *p, double *y, long long *taken_runs, double *states) {
  const asked a = {x0, u, d, p, y, runs, length};
  points now;
  lane own[LANES];
  v later[NX], ok[1];
  int busy = 0;
  memset(&now, 0, sizeof now);
  for (int l = 0; l < LANES; l++) {
    own[l].run = -1;
    own[l].states = states + l * length * NX;
    if (l < lanes) busy += next(&a, &now, l, own + l, taken_runs);
  }
  while (busy) {
    m moves = {0};
    trial(now.x, now.held, now.h, later, ok);
    for (int l = 0; l < LANES; l++)
      if (own[l].run >= 0 && taken(ok[0][l], &now, l, own + l)) moves[l] = -1;
    for (int i = 0; i < NX; i++) now.x[i] = pick(moves, later[i], now.x[i]);
    for (int l = 0; l < LANES; l++) {
      if (!moves[l] || !ended(&a, &now, l, own + l)) continue;
      show(&a, own + l);
      busy -= !next(&a, &now, l, own + l, taken_runs);
    }
  }
}
