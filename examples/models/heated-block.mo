model HeatedBlock "a block with a heater, in a room"
  parameter Real C(unit="J/K", min=0) = 50 "heat capacity";
  parameter Real k(unit="W/K", min=0) = 0.1 "loss to the room";
  parameter Real g(unit="W", min=0) = 0.2 "heater, per percent";
  input Real u(unit="%") "power of the heater";
  input Real Ta(unit="degC") "room";
  output Real y(unit="degC") = T;
  Real T(unit="degC", start=20) "block";
  Real loss(unit="W") = k*(T - Ta);
equation
  C*der(T) = g*u - loss;
end HeatedBlock;
