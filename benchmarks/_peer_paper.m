% The paper's estimates by its own tool: amplitude and phase of each sine by fminsearch (eq. 12-14), the gain from the
% steps' final speeds (eq. 15), the pole by fminsearch on dB and degrees (eq. 16-19). One line of JSON for each motor.
1;

function cost = sine_cost(x, t, f, v)
  cost = sum((v - x(1) * sin(2 * pi * f * t + x(2))).^2);
end

function cost = pole_cost(a, K, f, V, T)
  s = 2i * pi * f;
  G = K * a ./ (s + a) .* (1 - exp(-s * T)) ./ (s * T);
  ratio = V ./ G;
  cost = sum((20 * log10(abs(ratio))).^2 + (angle(ratio) * 180 / pi).^2);
end

files = argv();
for n = 1:numel(files)
  d = load(files{n});
  begin = cputime();
  V = []; f = []; gains = [];
  last = [d.first(2:end) - 1, numel(d.volts)];
  for k = 1:numel(d.first)
    rows = d.first(k):last(k);
    angle_rad = d.counts(rows) * d.rad_per_count;
    if d.kind(k) == 1
      v = diff(angle_rad) / d.period_s;
      t = (1:numel(v)) * d.period_s;
      x = [max(abs(v)), 0];
      best = Inf;
      for phase = [0, -1, -2]  % from several phases, so that the simplex does not end in a wrong one
        [trial, cost] = fminsearch(@(x) sine_cost(x, t, d.frequency_Hz(k), v), [x(1), phase]);
        if cost < best
          best = cost; x = trial;
        end
      end
      V(end + 1) = x(1) * exp(1i * x(2)) / d.amplitude_V(k);
      f(end + 1) = d.frequency_Hz(k);
    elseif d.kind(k) == 2
      half = floor(numel(angle_rad) / 2);
      speed = (angle_rad(end) - angle_rad(half)) / (d.period_s * (numel(angle_rad) - half));
      gains(end + 1) = speed / d.amplitude_V(k);
    end
  end
  K = mean(gains);
  a = fminsearch(@(a) pole_cost(a, K, f, V, d.period_s), 30);
  printf('[%.12g, %.12g, %.3f]\n', K, a, cputime() - begin);
end
