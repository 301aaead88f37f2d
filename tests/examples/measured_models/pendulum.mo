model Pendulum "free swing of an arm with viscous friction"
  parameter Real w2(unit="1/s2", min=0, max=1000) = 30 "gravity over length";
  parameter Real b(unit="1/s", min=0, max=10) = 0.05 "viscous friction";
  output Real theta(unit="rad") = a "angle from hanging";
  Real a(unit="rad", start=-1.6) "angle from hanging";
  Real w(unit="rad/s", start=0) "angular speed";
equation
  der(a) = w;
  der(w) = -w2*sin(a) - b*w;
end Pendulum;
