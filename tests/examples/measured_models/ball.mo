model Ball "free fall"
  final parameter Real g(unit="m/s2") = 9.81 "gravity";
  output Real y(unit="m") = h "height";
  Real h(unit="m", start=47) "height";
  Real w(unit="m/s", start=0) "speed, upwards";
equation
  der(h) = w;
  der(w) = -g;
end Ball;
