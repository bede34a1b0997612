/* Vectors of LANES numbers, and what of CasADi's operations C has no sign for; see lanes.py. */
#include <math.h>
#include <string.h>
#ifdef __AVX512F__
#define LANES 8
#else
#define LANES 4 /* eight are slower where they take two instructions each */
#endif
typedef double v __attribute__((vector_size(8 * LANES)));
typedef long long m __attribute__((vector_size(8 * LANES)));
#define EVERY(f) static inline v f##_v(v a) \
  { v r; for (int l = 0; l < LANES; l++) r[l] = f(a[l]); return r; }
static inline v all(double a) { v r; for (int l = 0; l < LANES; l++) r[l] = a; return r; }
static inline v pick(m c, v a, v b) { return (v)((c & (m)a) | (~c & (m)b)); }
static inline v truth(m c) { return (v)(c & (m)all(1.0)); }
static inline m holds(v a) { return a != all(0.0); }
static inline v kept(v c, v a) { return (v)(holds(c) & (m)a); }
static inline v greater(v a, v b) { return pick((a >= b) | (b != b), a, b); }
static inline v smaller(v a, v b) { return pick((a <= b) | (b != b), a, b); }
static inline double sign(double a) { return a < 0 ? -1 : a > 0 ? 1 : a; }
static inline int any(m c) { for (int l = 0; l < LANES; l++) if (c[l]) return 1; return 0; }
EVERY(sqrt) EVERY(fabs) EVERY(exp) EVERY(log) EVERY(sin) EVERY(cos) EVERY(tan) EVERY(asin)
EVERY(acos) EVERY(atan) EVERY(sinh) EVERY(cosh) EVERY(tanh) EVERY(floor) EVERY(ceil) EVERY(sign)
EVERY(log1p) EVERY(expm1)
static inline v pow_v(v a, v b)
  { v r; for (int l = 0; l < LANES; l++) r[l] = pow(a[l], b[l]); return r; }
static inline v atan2_v(v a, v b)
  { v r; for (int l = 0; l < LANES; l++) r[l] = atan2(a[l], b[l]); return r; }
static inline v hypot_v(v a, v b)
  { v r; for (int l = 0; l < LANES; l++) r[l] = hypot(a[l], b[l]); return r; }
static inline v copysign_v(v a, v b)
  { v r; for (int l = 0; l < LANES; l++) r[l] = copysign(a[l], b[l]); return r; }
