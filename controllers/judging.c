/* Costs of plans in lanes: behind lanes.h, HORIZON, sample() and last(); see judging.py. */
/* begun (6), shares (4, HORIZON, plans), query (4), weights (HORIZON), costs (plans) */
void judge(long long plans, const double *begun, const double *shares, const double *query,
           const double *weights, double *costs) {
  v asked[4];
  for (int i = 0; i < 4; i++) asked[i] = all(query[i]);
  for (long long first = 0; first < plans; first += LANES) {
    v memory[6], next[6], share[4], weight[1], cost[1];
    for (int i = 0; i < 6; i++) memory[i] = all(begun[i]);
    for (int k = 0; k < HORIZON; k++) {
      for (int l = 0; l < LANES; l++) {
        const long long plan = first + l < plans ? first + l : plans - 1;
        for (int i = 0; i < 4; i++) share[i][l] = shares[(plan * HORIZON + k) * 4 + i];
      }
      weight[0] = all(weights[k]);
      sample(memory, share, asked, weight, next);
      memcpy(memory, next, sizeof memory);
    }
    last(memory, asked, cost);
    for (int l = 0; l < LANES && first + l < plans; l++) costs[first + l] = cost[0][l];
  }
}
