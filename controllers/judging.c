/* Costs of plans in lanes: behind lanes.h, HORIZON, sample() and last(); see judging.py. */
/* x (4), shares (2, HORIZON, plans), query (3), weights (HORIZON), costs (plans) */
void judge(long long plans, const double *x, const double *shares, const double *query,
           const double *weights, double *costs) {
  v asked[3];
  for (int i = 0; i < 3; i++) asked[i] = all(query[i]);
  for (long long first = 0; first < plans; first += LANES) {
    v memory[6], next[6], share[2], weight[1], cost[1];
    for (int i = 0; i < 4; i++) memory[i] = all(x[i]);
    memory[4] = all(query[1] * (query[0] - x[2]));
    memory[5] = all(0.0);
    for (int k = 0; k < HORIZON; k++) {
      for (int l = 0; l < LANES; l++) {
        const long long plan = first + l < plans ? first + l : plans - 1;
        for (int i = 0; i < 2; i++) share[i][l] = shares[(plan * HORIZON + k) * 2 + i];
      }
      weight[0] = all(weights[k]);
      sample(memory, share, asked, weight, next);
      memcpy(memory, next, sizeof memory);
    }
    last(memory, asked, cost);
    for (int l = 0; l < LANES && first + l < plans; l++) costs[first + l] = cost[0][l];
  }
}
