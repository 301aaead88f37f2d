model MassSpring "a mass on a spring that stiffens, pulled by a force"
  parameter Real m(unit="kg", min=0) = 1 "mass";
  parameter Real k(unit="N/m", min=0) = 60 "spring";
  parameter Real k3(unit="N/m3", min=0) = 5000 "how much it stiffens";
  parameter Real d(unit="N.s/m", min=0) = 1 "damper";
  input Real F(unit="N") "force";
  output Real x(unit="m", start=0) "position";
  Real v(unit="m/s", start=0) "speed";
equation
  der(x) = v;
  m*der(v) = F - k*x - k3*x^3 - d*v;
end MassSpring;
